import sys,time,glob
from ev4 import *
D=sys.argv[1]; LB=sys.argv[2]
for f in sorted(glob.glob(D+'/*.bin')):
    if os.path.getsize(f)<100: continue
    n=os.path.basename(f)[:3]
    if len(sys.argv)>3 and n not in sys.argv[3:]: continue
    t0=time.time()
    lab=json.load(open(LB+'/%s.json'%n)); C=Case4(f); C3=Case3(f)
    truth='+'.join(sorted(e['id'] for e in lab['effects'])) or 'none'
    A=[0.4,1,2.2,5,12,30]; Kp=[0.03,0.1,0.2,0.4,0.8]
    scr=sorted(((C3.score(c,kappa=0.15,a=1,tau=1.2),k) for k,c in C.by.items()),reverse=True)
    rows=[]
    for _,k in scr[:7]+[x for x in scr[7:] if x[1] in (truth,'none')]:
        c=C.by[k]; ne=len(c['effects']); nrm=-1e99; wide=-1e99; an=aw=kn=0
        for a in A:
            for kk in (Kp if ne else [0.1]):
                v=C.score(c,a=a,kappa=kk,tau=1.2)-3.4*ne
                pk=-0.5*((np.log(kk)-np.log(0.15))/0.9)**2 if ne else 0
                x=v+pk-0.5*(np.log(a)/0.7)**2
                y=v+pk-0.5*((np.log(a)-np.log(8))/0.9)**2-2
                if x>nrm: nrm,an,kn=x,a,kk
                if y>wide: wide,aw=y,a
        rows.append((nrm,k,an,kn,wide,aw))
    top=max(max(r[0],r[4]) for r in rows)
    rows.sort(key=lambda r:-max(r[0],r[4]))
    Z=sum(np.exp(r[0]-top)+np.exp(r[4]-top) for r in rows); pn=sum(np.exp(r[4]-top) for r in rows)/Z
    old='+'.join(sorted([c for c in C.c if c['kind']=='best'][0]['effects'])) if [c for c in C.c if c['kind']=='best'] else '?'
    st=lab.get('stranger',{}) or {}
    print('==',n,lab['kind'],truth,'|',st.get('families'),st.get('nuisances'),st.get('motion'),'g/f %.1f'%lab['gap_over_floor'],'E %.1f'%C.nom['energy'],'| old:',old,'| P(none of mine) %.2f'%pn,'%.0fs'%(time.time()-t0))
    print('     ','; '.join('%s %.0f(a%.1f k%.2f P%.2f)'%(r[1],r[0]-top,r[2],r[3],np.exp(r[0]-top)/Z) for r in rows[:4]),'| truth','; '.join('%.0f (a%.1f k%.2f)'%(r[0]-top,r[2],r[3]) for r in rows if r[1]==truth),'none','; '.join('%.0f (a%.1f)'%(r[0]-top,r[2]) for r in rows if r[1]=='none'))
    sys.stdout.flush()
