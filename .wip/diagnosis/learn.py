import json,glob,os,sys,numpy as np
from scipy.optimize import minimize
from scipy.special import logsumexp
def load(b,s):
    out=[]
    for f in sorted(glob.glob(f'{b}/*.json')):
        n=os.path.basename(f)[:-5]; L=json.load(open(f'{s}/labels/{n}.json'))
        try: B=json.load(open(f))
        except Exception: continue
        if not B['sets']: continue
        c=dict(n=n,src=s,kind=L['kind'],truth=frozenset(e['id'] for e in L['effects']),gap=L.get('gap_over_floor') or L['gap_over_noise'],added=L.get('added_over_floor') or L['added_over_noise'],L=L,B=B)
        out.append(c)
    return out
TEMPER=float(__import__('os').environ.get('T','0.06'))
NAMES=['mu_a','ls_a','mu_k','ls_k','mu_o','ls_o','ls_w','ltemper','eff','oth']
P0=np.array([0.0,np.log(.7),np.log(.1),np.log(.6),np.log(.5),np.log(.5),np.log(.7),np.log(.15),-3.4,-2.0])
W=np.array([.7,.4,1,.4,1,.4,.4,.8,2,2])
def posts(c,p):
    mu_a,ls_a,mu_k,ls_k,mu_o,ls_o,ls_w,lt,eff,oth=p
    t=np.exp(lt); rows=[]
    for s in c['B']['sets']:
        cells=np.array(s['cells'],dtype=float)
        if len(cells)==0: continue
        la,lk,lw,ld=np.log(cells[:,0]),np.log(cells[:,1]),np.log(cells[:,2]),cells[:,3]
        k=len(s['effects'])
        def pr(x,mu,ls): return -0.5*((x-mu)/np.exp(ls))**2-ls
        lw=lw-0.5*lt
        pr1=lambda x,mu,ls: -0.5*(np.maximum(x-mu,0)/np.exp(ls))**2-ls
        base=t*ld+pr(lw,0,ls_w)+pr1(la,mu_a,ls_a)
        mine=np.max(base+pr1(lk,mu_k,ls_k))+eff*k
        other=np.max(base+pr(lk,mu_o,ls_o))+eff*k+oth
        if s.get('at_bound'): mine=-1e9
        rows.append((frozenset(s['effects']),mine,other,s))
    return rows
def probs(c,p):
    r=posts(c,p); al=np.array([[x[1],x[2]] for x in r]); z=logsumexp(al)
    return [(x[0],np.exp(x[1]-z),np.exp(x[2]-z),x[3]) for x in r]
def ptrue(c,p):
    pr=probs(c,p)
    if c['kind']=='outside' : return sum(x[2] for x in pr) if c['gap']>=1.5 else None
    if c['kind']!='none' and c['gap']<1.5: return None
    T=c['truth']
    q=sum(x[1] for x in pr if x[0]==T)
    if c['kind']=='single': # form from another family: the name with something left is half right
        q+=0.5*sum(x[2] for x in pr if x[0]==T)
    if c['kind']=='pair': q+=0.5*sum(x[2] for x in pr if x[0]==T)+0.3*sum(x[1] for x in pr if len(x[0])==1 and x[0]<T)
    return q
def obj(p,cs):
    v=0;n=0
    for c in cs:
        q=ptrue(c,p)
        if q is None: continue
        v-=np.log(0.03+0.97*q); n+=1
    return v/n+0.01*np.sum(((p-P0)/W)**2)
def report(cs,p):
    cnt={}
    def add(k,ok): a=cnt.setdefault(k,[0,0]); a[0]+=ok; a[1]+=1
    rel=[]
    for c in cs:
        pr=sorted(probs(c,p),key=lambda x:-x[1]-x[2]); q=ptrue(c,p)
        other=sum(x[2] for x in pr); top=pr[0]; none=sum(x[1] for x in pr if not x[0])
        src='st' if 'st' in c['src'] else 'own'
        verdict='no_gap' if not top[0] and other<.5 else 'unknown' if (not top[0] or (other>.5 and top[3]['shrink']<.5)) else 'partial' if other>.5 else 'named'
        if top[3].get('at_bound') and verdict!='no_gap': verdict='unknown'
        inc={}
        for x in pr:
            for e in x[0]: inc[e]=inc.get(e,0)+x[1]+x[2]
        vis=c['gap']>=1.5
        single={tuple(s['effects']):s['shrink'] for s in c['B']['sets'] if len(s['effects'])==1}
        first=max(top[0],key=lambda e:single.get((e,),-9)) if top[0] else None
        if c['kind']=='none': add(src+' none ok',verdict=='no_gap')
        if c['kind']=='outside' and vis: add(src+' outside unk',verdict=='unknown'); add(src+' outside unk/part',verdict in('unknown','partial'))
        if c['kind']=='single' and vis:
            add(src+' single first',verdict in('named','partial') and first in c['truth'])
            add(src+' single in set',verdict in('named','partial') and bool(c['truth']&top[0]))
            add(src+' single exact',verdict in('named','partial') and c['truth']==top[0])
        if c['kind']=='pair' and vis: add(src+' pair both',verdict in('named','partial') and c['truth']<=top[0])
        if verdict in ('named','partial'):
            for e in top[0]: rel.append((inc[e],e in c['truth']))
        print(c['n'],src,c['kind'][:6],'gap %.1f'%c['gap'],'q',None if q is None else round(q,2),'oth %.2f'%other,verdict,'T',sorted(c['truth']),'| top',sorted(top[0]),'%.2f/%.2f'%(top[1],top[2]),'sh %.2f'%top[3]['shrink'],'wst %.1f'%top[3]['worst'], '| 2nd',sorted(pr[1][0]) if len(pr)>1 else '', '%.2f'%(pr[1][1]+pr[1][2]) if len(pr)>1 else '')
    for k in sorted(cnt): print(k,cnt[k][0],'/',cnt[k][1])
    rel.sort(); 
    for lo,hi in [(0,.5),(.5,.8),(.8,.95),(.95,1.01)]:
        x=[r for r in rel if lo<=r[0]<hi]
        if x: print('conf %.2f-%.2f: n %d mean %.2f true %.2f'%(lo,hi,len(x),np.mean([r[0] for r in x]),np.mean([r[1] for r in x])))
if __name__=='__main__':
    import sys
    cs=sum([load(a,b) for a,b in [x.split(':') for x in sys.argv[1:] if ':' in x]],[])
    print(len(cs),'cases')
    p=P0
    if 'fix' not in sys.argv:
        print('start',obj(p,cs))
        r=minimize(obj,p,args=(cs,),method='Powell',options=dict(maxiter=4,xtol=2e-2,ftol=1e-3)); p=r.x
        print('end',r.fun)
        json.dump(list(map(float,p)),open('/tmp/prior2.json','w'))
    for n,x in zip(NAMES,p): print(n, round(float(np.exp(x)) if n not in('eff','oth') else float(x),3))
    report(cs,p)
