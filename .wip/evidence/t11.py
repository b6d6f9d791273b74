import json,glob,sys,numpy as np
P=dict(amu=0.0,asd=0.7,kmu=np.log(0.15),ksd=0.9,eff=-3.4,wmu=np.log(8),wsd=0.9,wpr=-2.0,temper=1.0,mat=0.35)
def analyse(d,P,verbose=True):
    rows=[]
    for r in d['rows']:
        nrm=wid=-1e99
        for a,k,v in r['grid']:
            v=v*P['temper']
            pk=-0.5*((np.log(k)-P['kmu'])/P['ksd'])**2 if r['ne'] else 0
            x=v+pk-0.5*((np.log(a)-P['amu'])/P['asd'])**2+P['eff']*r['ne']
            y=v+pk-0.5*((np.log(a)-P['wmu'])/P['wsd'])**2+P['eff']*r['ne']+P['wpr']
            if x>nrm: nrm,an,kn=x,a,k
            wid=max(wid,y)
        rows.append((r['set'],nrm,wid,an,kn,r['mat'],r['ne']))
    top=max(max(r[1],r[2]) for r in rows)
    Z=sum(np.exp(r[1]-top)+np.exp(r[2]-top) for r in rows)
    pn=sum(np.exp(r[2]-top) for r in rows)/Z
    pe=sum(np.exp(r[1]-top) for r in rows if r[6]==0 or r[5]<P['mat'])/Z
    rows.sort(key=lambda r:-r[1])
    marg={}
    for r in rows:
        for e in r[0].split('+'):
            if r[6]: marg[e]=marg.get(e,0)+np.exp(r[1]-top)/Z
    return rows,top,Z,pn,pe,marg
if __name__=='__main__':
    for f in sorted(glob.glob(sys.argv[1]+'/*.json')):
        d=json.load(open(f)); rows,top,Z,pn,pe,marg=analyse(d,P)
        st=d['st'] or {}
        print('%s %-8s %-48s g/f %.1f old %-40s | none-of-mine %.2f no-gap %.2f'%(d['case'],d['kind'],d['truth'],d['gap'],d['old'],pn,pe),st.get('families'))
        print('      ','; '.join('%s %.0f (a%.1f k%.2f m%.1f P%.2f)'%(r[0],r[1]-top,r[3],r[4],r[5],np.exp(r[1]-top)/Z) for r in rows[:4]),'| truth','; '.join('%.0f a%.1f k%.2f m%.1f'%(r[1]-top,r[3],r[4],r[5]) for r in rows if r[0]==d['truth']),'| none','; '.join('%.0f a%.1f'%(r[1]-top,r[3]) for r in rows if r[0]=='none'))
